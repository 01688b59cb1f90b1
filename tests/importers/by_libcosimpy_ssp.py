"""libcosim through libcosimpy on the archive's system structure, the driver FMU added to it."""

from by_libcosimpy import NANOSECONDS, references, simulate
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimSlave import CosimLocalSlave
from shared import read_task


def main() -> None:
    task = read_task()
    execution = CosimExecution.from_ssp_file(str(task.components_only), task.step * NANOSECONDS)
    indices = {info.name.decode(): info.index for info in execution.slave_infos()}
    driver = CosimLocalSlave(fmu_path=str(task.files["driver"]), instance_name="driver")
    indices["driver"] = execution.add_local_slave(driver)
    named = {name: references(execution, index) for name, index in indices.items()}
    for source, output, target, variable in task.connections:
        if source == "driver":
            execution.connect_real_variables(
                indices[source], named[source][output], indices[target], named[target][variable]
            )
    simulate(task, execution, indices[task.shown])


if __name__ == "__main__":
    main()
