"""Every effect of the rig, by the name that the project's formats use; `unlisted_...` are on no list."""

from __future__ import annotations

from tests.rig.constants import Attachment, CentreOfMass, Damping, Inertia, Modulus, Payload
from tests.rig.effect import Effect
from tests.rig.material import Creep, Hysteresis, Pushing, Relaxation, Slack, Stiffening, Thermal
from tests.rig.outside import Drag, RotationalDrag, SensorDelay, SensorGain, SensorOffset
from tests.rig.route import Anchor, Frame, Pulley, Sag, TransverseDamping
from tests.rig.unlisted import Bungee, Filling, Gusts, Magnet, Shaker, Sideways, Slipping, Swing, Wave
from tests.rig.winch import Drum, Friction

EFFECTS: dict[str, type[Effect]] = {
    "damping": Damping,
    "modulus": Modulus,
    "relaxation": Relaxation,
    "hysteresis": Hysteresis,
    "creep": Creep,
    "thermal": Thermal,
    "sag": Sag,
    "pulley": Pulley,
    "anchor": Anchor,
    "drum": Drum,
    "friction": Friction,
    "payload": Payload,
    "drag": Drag,
    "slack": Slack,
    "sensor_delay": SensorDelay,
    "sensor_gain": SensorGain,
    "sensor_offset": SensorOffset,
    "transverse_damping": TransverseDamping,
    "centre_of_mass": CentreOfMass,
    "attachment": Attachment,
    "inertia": Inertia,
    "rotational_drag": RotationalDrag,
    "unlisted_bungee": Bungee,
    "unlisted_filling": Filling,
    "unlisted_frame": Frame,
    "unlisted_gusts": Gusts,
    "unlisted_magnet": Magnet,
    "unlisted_pushing": Pushing,
    "unlisted_shaker": Shaker,
    "unlisted_sideways": Sideways,
    "unlisted_slipping": Slipping,
    "unlisted_stiffening": Stiffening,
    "unlisted_swing": Swing,
    "unlisted_wave": Wave,
}
