"""The C that a plant's description turns into: plant_vars.h for the plant, plant_model.c for the adapter."""

from __future__ import annotations

import math
from collections.abc import Iterable

from foreshock_fmus._description import PlantDescription

__all__ = ["model_source", "variables_header"]


def variables_header(plant: PlantDescription) -> str:
    """``plant_vars.h``: V_<name> is the value reference of a scalar or of a row's first, LEN_<name> a row's length."""
    lines = []
    reference = 0
    for v in plant.variables:
        comment = " ".join(f"{v.causality}, {v.unit}. {v.description}".replace("*/", "* /").split())
        lines.append(f"    V_{v.symbol} = {reference}, /* {comment} */")
        if v.first is not None:
            lines.append(f"    LEN_{v.symbol} = {v.size},")
        reference += v.size
    body = "\n".join(lines)
    return (
        f"/* Variables of {plant.id}: generated from its description. */\n"
        f"#ifndef PLANT_VARS_H\n#define PLANT_VARS_H\n\nenum {{\n{body}\n    N_VARS = {reference}\n}};\n\n#endif\n"
    )


def model_source(plant: PlantDescription, token: str) -> str:
    """``plant_model.c``: the tables that adapter.h declares."""
    scalars = [(name, i, v) for v in plant.variables for i, name in enumerate(v.scalars())]
    return (
        f"/* Tables of {plant.id}: generated from its description. */\n"
        '#include <math.h>\n\n#include "adapter.h"\n\n'
        f'const char *const plant_token = "{token}";\n'
        + _array("const char *const plant_name", (f'"{name}"' for name, _, _ in scalars))
        + _array("const unsigned char plant_causality", (f"CAUSALITY_{v.causality.upper()}" for _, _, v in scalars))
        + _array("const double plant_start", (_number(v.start[i] if v.start else 0.0) for _, i, v in scalars))
        + _array("const double plant_min", (_number(v.min) for _, _, v in scalars))
        + _array("const double plant_max", (_number(v.max) for _, _, v in scalars))
    )


def _array(declaration: str, items: Iterable[str]) -> str:
    body = "".join(f"    {item},\n" for item in items)
    return f"\n{declaration}[N_VARS] = {{\n{body}}};\n"


def _number(value: float) -> str:
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    return repr(float(value))
