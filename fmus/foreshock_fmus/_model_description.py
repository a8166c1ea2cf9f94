"""modelDescription.xml of FMI 2.0 and 3.0, and buildDescription.xml, from a plant's description."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias
from xml.etree import ElementTree

from foreshock_fmus._description import PlantDescription, PlantVariable
from foreshock_fmus._units import BASE_UNITS, parse_unit

__all__ = ["DEFINITIONS", "LANGUAGE", "build_description", "model_description"]

Element = ElementTree.Element

LANGUAGE = "C11"
# POSIX names such as M_PI, which strict C11 hides.
DEFINITIONS = {"_XOPEN_SOURCE": "700"}
_GENERATOR = "foreshock"


def model_description(plant: PlantDescription, fmi_version: int, token: str, sources: Sequence[str]) -> bytes:
    """modelDescription.xml.

    Args:
        plant: the description.
        fmi_version: 2 or 3.
        token: guid or instantiation token.
        sources: names of the C files under ``sources/``, which FMI 2 lists here.
    """
    three = fmi_version == 3
    root = Element("fmiModelDescription", fmiVersion="3.0" if three else "2.0", modelName=plant.title)
    root.set("instantiationToken" if three else "guid", token)
    if plant.description:
        root.set("description", " ".join(plant.description.split()))
    root.set("generationTool", _GENERATOR)
    root.set("variableNamingConvention", "structured")
    state = "FMUState" if three else "FMUstate"
    cs = _add(root, "CoSimulation", modelIdentifier=plant.id, canHandleVariableCommunicationStepSize="true")
    cs.set(f"canGetAndSet{state}", "true")
    cs.set(f"canSerialize{state}", "true")
    if not three:
        cs.set("canNotUseMemoryManagementFunctions", "true")
        files = _add(cs, "SourceFiles")
        for name in sources:
            _add(files, "File", name=name)
    _add_units(root, plant)
    categories = _add(root, "LogCategories")
    _add(categories, "Category", name="logStatusDiscard", description="Why a step was refused")
    _add(categories, "Category", name="logStatusError", description="Why a call failed")
    _add(root, "DefaultExperiment", startTime="0.0", stepSize=repr(plant.default_step_s))
    (_add_variables_3 if three else _add_variables_2)(root, plant)
    return _xml(root)


def build_description(plant: PlantDescription, sources: Sequence[str]) -> bytes:
    """sources/buildDescription.xml of FMI 3.0."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = _add(root, "BuildConfiguration", modelIdentifier=plant.id)
    files = _add(configuration, "SourceFileSet", language=LANGUAGE)
    for name in sources:
        _add(files, "SourceFile", name=name)
    for name, value in DEFINITIONS.items():
        _add(files, "PreprocessorDefinition", name=name, value=value)
    _add(configuration, "Library", name="m", external="true")
    return _xml(root)


def _add_units(root: Element, plant: PlantDescription) -> None:
    units = _add(root, "UnitDefinitions")
    for name in sorted({v.unit for v in plant.variables} | {"s"}):
        unit = parse_unit(name)
        base = _add(_add(units, "Unit", name=name), "BaseUnit")
        for symbol, exponent in zip(BASE_UNITS, unit.exponents, strict=True):
            if exponent:
                base.set(symbol, str(exponent))
        if unit.factor != 1.0:
            base.set("factor", repr(unit.factor))


def _attributes(v: PlantVariable, i: int) -> dict[str, str]:
    """What both versions write on the typed element of one scalar."""
    found = {"unit": v.unit}
    if math.isfinite(v.min):
        found["min"] = repr(v.min)
    if math.isfinite(v.max):
        found["max"] = repr(v.max)
    if v.start:
        found["start"] = repr(v.start[i])
    return found


def _common(name: str, reference: int, v: PlantVariable) -> dict[str, str]:
    found = {"name": name, "valueReference": str(reference), "causality": v.causality}
    if v.description:
        found["description"] = " ".join(v.description.split())
    found["variability"] = "fixed" if v.causality == "parameter" else "continuous"
    return found


def _time(reference: int) -> dict[str, str]:
    """The independent variable."""
    return {"name": "time", "valueReference": str(reference), "causality": "independent", "variability": "continuous"}


_Scalar: TypeAlias = tuple[str, int, PlantVariable]


def _scalars(plant: PlantDescription) -> list[_Scalar]:
    return [(name, i, v) for v in plant.variables for i, name in enumerate(v.scalars())]


def _add_variables_3(root: Element, plant: PlantDescription) -> None:
    variables = _add(root, "ModelVariables")
    scalars = _scalars(plant)
    for reference, (name, i, v) in enumerate(scalars):
        _add(variables, "Float64", **_common(name, reference, v), **_attributes(v, i))
    _add(variables, "Float64", **_time(len(scalars)), unit="s")
    structure = _add(root, "ModelStructure")
    for tag in ("Output", "InitialUnknown"):
        for reference, (_, _, v) in enumerate(scalars):
            if v.causality == "output":
                unknown = _add(structure, tag, valueReference=str(reference))
                if tag == "Output":
                    _add_dependencies(unknown, v, scalars, 0)


def _add_variables_2(root: Element, plant: PlantDescription) -> None:
    variables = _add(root, "ModelVariables")
    scalars = _scalars(plant)
    for reference, (name, i, v) in enumerate(scalars):
        _add(_add(variables, "ScalarVariable", **_common(name, reference, v)), "Real", **_attributes(v, i))
    _add(_add(variables, "ScalarVariable", **_time(len(scalars))), "Real", unit="s")
    structure = _add(root, "ModelStructure")
    outputs = [i for i, (_, _, v) in enumerate(scalars, start=1) if v.causality == "output"]
    for tag in ("Outputs", "InitialUnknowns") if outputs else ():
        unknowns = _add(structure, tag)
        for i in outputs:
            unknown = _add(unknowns, "Unknown", index=str(i))
            if tag == "Outputs":
                _add_dependencies(unknown, scalars[i - 1][2], scalars, 1)


def _add_dependencies(unknown: Element, v: PlantVariable, scalars: Sequence[_Scalar], at: int) -> None:
    """What an output depends on directly; left out, the standard takes it to depend on everything (FMI 2.0.4, 2.2.8).

    Args:
        unknown: the element.
        v: the output.
        scalars: all scalars in order.
        at: number of the first: value references begin at 0, FMI 2's indices at 1.
    """
    if v.depends is not None:
        inputs = (str(k) for k, (_, _, u) in enumerate(scalars, start=at) if u.name in v.depends)
        unknown.set("dependencies", " ".join(inputs))


def _add(parent: Element, tag: str, **attributes: str) -> Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _xml(root: Element) -> bytes:
    ElementTree.indent(root)
    text: bytes = ElementTree.tostring(root, encoding="utf-8")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + text + b"\n"
