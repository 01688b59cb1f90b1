"""Definition of an effect: data and a few functions, each for the stage where the effect acts."""

from typing import Any, Callable, Dict, Mapping, NamedTuple, Optional, Tuple


class Parameter(NamedTuple):
    """Parameter of an effect.

    ``neutral`` is the value of a parameter that is not given: with all parameters neutral the effect is exactly
    absent. None where that is the value that the robot file declares for the cable under the key of the same name;
    such a parameter has to be given. Fits start at ``start_ratio`` times the declared value, or at ``start`` where
    nothing or zero is declared; neither is the neutral value. ``multistart_values`` are the starts of a multi-start fit
    where one start could end in a local optimum: of parameters that act only while others are not neutral.
    ``grid_values`` are further starting values for the grid search over a parameter whose score at neutral is zero or
    misleading. One that ``needs_rigid_body`` is not for robots whose platform is a point mass.
    """

    name: str
    unit: str
    description: str
    minimum: float
    maximum: float
    neutral: Optional[float]
    start: float
    start_ratio: float = 1.0
    multistart_values: Tuple[float, ...] = ()
    grid_values: Tuple[float, ...] = ()
    needs_rigid_body: bool = False

    @property
    def is_time_constant(self) -> bool:
        """Whether it is the time constant of a state that is always there; a delay, or a sensor's filter, is none."""
        return self.unit == "s" and self.minimum > 0.0


class State(NamedTuple):
    """State of an effect; it starts at zero.

    ``scale`` is a typical size, in ``unit``; a ten-millionth of it is negligible. A state that ``drifts`` has no
    equilibrium: where the robot rests it is taken as it was at the start.
    """

    name: str
    unit: str
    description: str
    scale: float = 1.0
    drifts: bool = False


class Effect(NamedTuple):
    """Physical effect that the plain robot model lacks.

    Stages, each a function or None where the effect does not act there; the first two arguments of all are ``m`` and
    ``values``. Contributions of one stage add up (or their logarithms do: transmission, gain), so the order of effects
    never matters; ``path`` and ``sag`` are stages of one effect alone.

    ==================== ============================================== ==============================================
    stage                further arguments                              gives
    ==================== ============================================== ==============================================
    ``exit_point``                                                      m, vector from the declared exit point
    ``attachment``                                                      m, vector from the declared attachment
    ``path``             ``line`` (m, platform to exit point)           unit vector at the platform, and length in m
    ``stiffness``        ``states, cable``                              Pa added to the modulus, Pa added at no strain
    ``viscosity``        ``cable``                                      Pa s, added to the damping
    ``free_strain``      ``states``                                     strain that carries no tension
    ``free_strain_rate`` ``states, cable, tension``                     1/s, its rate under an elastic tension in N
    ``sag``              ``cable, line, strain, stiffness``             ln(arc / chord), now and at the start
    ``rope_speed``       ``states, winch_speed, tension``               m/s, added at the winch
    ``tension``          ``states, cable, motion``                      N, added in the rope
    ``softening``        ``cable, pull``                                N, added to ``max(pull, 0)``
    ``ends``             ``gravity, line, tension``                     N, vector on the platform; N at the load cell
    ``lateral_force``    ``line``                                       N, vector on the platform
    ``transmission``     ``motion``                                     ln(tension / that of the span) at platform, cell
    ``inertia``          ``states``                                     kg, added on the platform
    ``mass_position``                                                   m, vector from the centre of mass to these kg
    ``centre_of_mass``                                                  m, vector from the declared centre of mass
    ``inertia_factors``                                                 factors of the three principal moments
    ``wrench``           ``states, position, velocity``                 N, vector on the platform
    ``moment``           ``angular_velocity``                           N m, vector on the platform
    ``gain``                                                            factors of measured tension and position
    ``offset``                                                          N and m, added to these: a number, a vector
    ``delay``                                                           s, of measured tension and position
    ``low_pass``                                                        s, time constant of the load cell's filter
    ==================== ============================================== ==============================================

    ``attachment``, ``mass_position`` and ``centre_of_mass`` are in the platform's frame, other vectors in the world's.
    ``line`` is a :class:`tautwire_fmu.laws.cable.Span`, but in ``path``.

    ``values`` is the class of the parameters (a NamedTuple, one field a parameter, in order). ``state_rates`` gives a
    tuple, one rate a state, from ``m, values, states, cable, motion``; an effect with ``low_pass`` has one state
    instead, that of the filter, on cables alone; see :func:`tautwire_fmu.laws.effect_stages.low_pass`. ``forms`` are
    the sets of parameters that a fit estimates together; the others stay neutral. One that is not
    ``is_tried_on_point_masses`` would take the name of something else there.
    """

    name: str
    component: str
    description: str
    parameters: Tuple[Parameter, ...]
    values: Callable[..., Any]
    source: str
    forms: Tuple[Tuple[str, ...], ...] = ()
    is_tried_on_point_masses: bool = True
    states: Tuple[State, ...] = ()
    state_rates: Optional[Callable[..., Any]] = None
    exit_point: Optional[Callable[..., Any]] = None
    attachment: Optional[Callable[..., Any]] = None
    path: Optional[Callable[..., Any]] = None
    stiffness: Optional[Callable[..., Any]] = None
    viscosity: Optional[Callable[..., Any]] = None
    free_strain: Optional[Callable[..., Any]] = None
    free_strain_rate: Optional[Callable[..., Any]] = None
    sag: Optional[Callable[..., Any]] = None
    rope_speed: Optional[Callable[..., Any]] = None
    tension: Optional[Callable[..., Any]] = None
    softening: Optional[Callable[..., Any]] = None
    ends: Optional[Callable[..., Any]] = None
    lateral_force: Optional[Callable[..., Any]] = None
    transmission: Optional[Callable[..., Any]] = None
    inertia: Optional[Callable[..., Any]] = None
    mass_position: Optional[Callable[..., Any]] = None
    centre_of_mass: Optional[Callable[..., Any]] = None
    inertia_factors: Optional[Callable[..., Any]] = None
    wrench: Optional[Callable[..., Any]] = None
    moment: Optional[Callable[..., Any]] = None
    gain: Optional[Callable[..., Any]] = None
    offset: Optional[Callable[..., Any]] = None
    delay: Optional[Callable[..., Any]] = None
    low_pass: Optional[Callable[..., Any]] = None

    def on_platform(self) -> "Effect":
        """The effect as it acts on the platform and its sensors, where load cells have no filters."""
        return self if self.low_pass is None else self._replace(states=(), low_pass=None)

    @property
    def only_sets_constants(self) -> bool:
        """Whether the effect only replaces a rope's modulus and damping by other constants."""
        used_stages = {name for name in self._fields[self._fields.index("states") :] if getattr(self, name)}
        return bool(used_stages) and used_stages <= {"stiffness", "viscosity"}

    @property
    def needs_rigid_body(self) -> bool:
        """Whether the effect has nothing for a platform that is a point mass."""
        return bool(self.parameters) and all(parameter.needs_rigid_body for parameter in self.parameters)

    def forms_on(self, is_rigid_body: bool) -> Tuple[Tuple[str, ...], ...]:
        """The forms to try on a platform that is a rigid body, or on one that is a point mass."""
        if not (is_rigid_body or self.is_tried_on_point_masses):
            return ()
        excluded = {parameter.name for parameter in self.parameters if parameter.needs_rigid_body and not is_rigid_body}
        return tuple(form for form in self.forms if not excluded & set(form))

    def completed_values(self, specified_values: Mapping[str, Any]) -> Dict[str, Any]:
        """Values of all parameters by name, neutral where not specified; KeyError where a required one is missing."""
        return {
            p.name: specified_values[p.name] if p.neutral is None else specified_values.get(p.name, p.neutral)
            for p in self.parameters
        }


class ActiveEffect(NamedTuple):
    """Effect with its parameter values, as it acts on one component."""

    effect: Effect
    values: Any
