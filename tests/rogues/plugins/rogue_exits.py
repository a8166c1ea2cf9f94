"""A plugin that ends the program when it is imported."""

raise SystemExit("this plugin needs a licence")
