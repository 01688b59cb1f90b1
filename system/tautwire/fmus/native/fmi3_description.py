"""Model description of a native FMU by FMI 3.0, from that of the same FMU by FMI 2.0."""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

INDEPENDENT_VARIABLE = "time"
FMI_2_ATTRIBUTES = ("fmiVersion", "guid", "numberOfEventIndicators")
STRUCTURE_TAGS = {"Output": "Outputs", "ContinuousStateDerivative": "Derivatives", "InitialUnknown": "InitialUnknowns"}
REAL_ATTRIBUTES = ("start", "unit", "min", "max", "nominal")


def fmi3_description(fmi2: Element) -> Element:
    """Description of the same variables with the same value references, and the time behind them.

    In FMI 3.0 references to variables are value references, not their places in the list.
    """
    attributes = {name: value for name, value in fmi2.attrib.items() if name not in FMI_2_ATTRIBUTES}
    root = Element(
        "fmiModelDescription", {"fmiVersion": "3.0", **attributes, "instantiationToken": fmi2.attrib["guid"]}
    )
    root.extend([*_model_exchange(fmi2), _cosimulation(fmi2)])
    for name in ("UnitDefinitions", "LogCategories", "DefaultExperiment"):
        part = fmi2.find(name)
        if part is not None:
            root.append(part)
    variables = fmi2.findall("ModelVariables/ScalarVariable")
    references = [variable.attrib["valueReference"] for variable in variables]
    parent = SubElement(root, "ModelVariables")
    for variable in variables:
        parent.append(_float_variable(variable, references))
    SubElement(
        parent,
        "Float64",
        {
            "name": INDEPENDENT_VARIABLE,
            "valueReference": str(len(variables)),
            "description": "simulation time: of the last communication point, or as set in model exchange",
            "causality": "independent",
            "variability": "continuous",
            "unit": "s",
        },
    )
    root.append(_structure(fmi2, references))
    return root


def build_description(name: str, entry_file: str) -> Element:
    """``sources/buildDescription.xml``: the one file to compile."""
    root = Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = SubElement(root, "BuildConfiguration", {"modelIdentifier": name})
    source_files = SubElement(configuration, "SourceFileSet", {"language": "C99"})
    SubElement(source_files, "SourceFile", {"name": entry_file})
    return root


def _model_exchange(fmi2: Element) -> list[Element]:
    return [
        Element(
            "ModelExchange",
            {
                "modelIdentifier": former.attrib["modelIdentifier"],
                "needsExecutionTool": "false",
                "canBeInstantiatedOnlyOncePerProcess": "false",
                "canGetAndSetFMUState": "true",
                "canSerializeFMUState": "true",
                "providesDirectionalDerivatives": former.attrib["providesDirectionalDerivative"],
                "providesAdjointDerivatives": "true",
                "needsCompletedIntegratorStep": "true",
            },
        )
        for former in fmi2.findall("ModelExchange")
    ]


def _cosimulation(fmi2: Element) -> Element:
    former = fmi2.find("CoSimulation")
    assert former is not None
    return Element(
        "CoSimulation",
        {
            "modelIdentifier": former.attrib["modelIdentifier"],
            "needsExecutionTool": "false",
            "canBeInstantiatedOnlyOncePerProcess": "false",
            "canGetAndSetFMUState": "true",
            "canSerializeFMUState": "true",
            "providesDirectionalDerivatives": former.attrib["providesDirectionalDerivative"],
            "providesAdjointDerivatives": "true",
            "canHandleVariableCommunicationStepSize": "true",
            "maxOutputDerivativeOrder": former.attrib["maxOutputDerivativeOrder"],
        },
    )


def _float_variable(variable: Element, references: list[str]) -> Element:
    real = variable[0]
    attributes = dict(variable.attrib)
    attributes |= {name: real.attrib[name] for name in REAL_ATTRIBUTES if name in real.attrib}
    if "derivative" in real.attrib:
        attributes["derivative"] = references[int(real.attrib["derivative"]) - 1]
    return Element("Float64", attributes)


def _structure(fmi2: Element, references: list[str]) -> Element:
    structure = Element("ModelStructure")
    times = [str(len(references))] if fmi2.find("ModelExchange") is not None else []
    indicator_count = int(fmi2.get("numberOfEventIndicators", "0"))
    for tag, former in STRUCTURE_TAGS.items():
        for unknown in fmi2.findall(f"ModelStructure/{former}/Unknown"):
            attributes = {"valueReference": references[int(unknown.attrib["index"]) - 1]}
            if "dependencies" in unknown.attrib:
                places = unknown.attrib["dependencies"].split()
                # A sensor that lags and a formula with the time change while inputs and states do not.
                own = [] if places == [unknown.attrib["index"]] or tag != "Output" else times
                attributes["dependencies"] = " ".join([*(references[int(place) - 1] for place in places), *own])
            SubElement(structure, tag, attributes)
    for reference in references[len(references) - indicator_count :]:
        SubElement(structure, "EventIndicator", {"valueReference": reference})
    return structure
