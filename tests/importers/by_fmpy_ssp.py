"""fmpy's simulate_ssp on the archive, with the start values that the FMUs hold in place of its zeros."""

import by_fmpy_ssp_as_it_is
import fmpy.ssp.simulation as simulation

instantiate = simulation.instantiate_fmu


def instantiate_with_values(component, *arguments, **named) -> None:
    """Take every connector's first value from the FMU."""
    instantiate(component, *arguments, **named)
    for connector in component.connectors:
        connector.value = simulation.get_value(component, connector.name)


if __name__ == "__main__":
    simulation.instantiate_fmu = instantiate_with_values
    by_fmpy_ssp_as_it_is.main()
