"""First-party detectors and policies. The core reaches them by entry points only, like anybody's."""
