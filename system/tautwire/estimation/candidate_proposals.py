"""Proposals of a selection: which hypotheses to try next, and from which starting values. Nothing is run here."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import inf

from ..robot.schema import EffectSetting, Robot
from .candidate_scores import CandidateScore
from .hypotheses import Hypothesis, searched_hypotheses, split_by_cable, with_hypothesis, with_larger_forms
from .policy import DEFAULT_POLICY, FitPolicy, ScoreTestPolicy, SelectionPolicy
from .score_test import PredictedGain


@dataclass(frozen=True)
class FitTask:
    """Fit of the chosen hypotheses to estimation data, from starts that are tried in turn; validated on other data.

    ``min_log_likelihood`` is that of the data without the last of them; for ``cost_tolerance`` see
    :meth:`tautwire.estimation.parameter_fit.Fitter.fit_from`. ``disturbance_refits`` counts how often the disturbance
    is fitted anew beside them, and they under it.
    """

    chosen: tuple[Hypothesis, ...]
    starts: tuple[Robot, ...]
    min_log_likelihood: float
    cost_tolerance: float
    disturbance_refits: int = 0


@dataclass(frozen=True)
class SearchRound:
    """Round of a selection: every hypothesis beside the accepted ones, which ``robot`` has, is to be scored.

    With a ``rival`` its alternatives are. ``is_white`` tells whether the robot's residual is white noise already, which
    with a disturbance it is.
    """

    number: int
    robot: Robot
    accepted: tuple[Hypothesis, ...]
    rival: CandidateScore | None
    is_white: bool
    has_disturbance: bool

    @property
    def is_ranking(self) -> bool:
        """Whether the hypothesis that is selected is fitted once more."""
        return self.has_disturbance or not self.is_white

    @property
    def stops_at_first(self) -> bool:
        """Whether the first candidate that leaves white noise is enough; alternatives are tested later."""
        return bool(self.accepted) and self.rival is None and not self.is_white

    def candidates(self, declared: Robot) -> list[Hypothesis]:
        """Hypotheses on the declared robot that could act beside the accepted ones, and without the rival."""
        excluded = [*self.accepted, self.rival.hypothesis] if self.rival else self.accepted
        tried = searched_hypotheses(declared, self.has_disturbance)
        return [h for h in tried if not any(a.overlaps(h) for a in excluded)]

    def tasks(
        self, starts: Mapping[Hypothesis, tuple[Robot, ...]], min_log_likelihood: float, policy: FitPolicy
    ) -> dict[Hypothesis, FitTask]:
        """Fits beside the accepted hypotheses; where they need only be ranked, coarse ones."""
        tolerance = policy.coarse_cost_tolerance if self.is_ranking else policy.fine_cost_tolerance
        return {
            h: FitTask(tuple(with_hypothesis(self.accepted, h)), robots, min_log_likelihood, tolerance)
            for h, robots in starts.items()
        }

    def larger_models(self) -> dict[Hypothesis, tuple[Robot, ...]]:
        """Larger forms of the accepted hypotheses, and each on its cables one by one, with starting values."""
        larger = [*with_larger_forms(self.accepted, self.robot), *split_by_cable(self.accepted)]
        return {h: (self.robot.with_effect(h.setting(self.robot)),) for h in larger}

    def refits(
        self,
        scores: Collection[CandidateScore],
        shortlisted: Sequence[Hypothesis],
        policy: SelectionPolicy,
        cost_tolerance: float,
    ) -> dict[Hypothesis, FitTask]:
        """Fits to all samples of the candidates whose coarse fits tie with the best, or with the rival.

        Without a rival the first of the shortlist are among them.
        """
        top = max((score.evidence for score in (*scores, *([self.rival] if self.rival else []))), default=0.0)
        min_evidence = top - policy.coarse_tie_nats - policy.coarse_tie_ratio * abs(top)
        always = () if self.rival else shortlisted[: policy.always_refitted]
        return {
            s.hypothesis: FitTask(
                tuple(with_hypothesis(self.accepted, s.hypothesis)), (s.fit.robot,), -inf, cost_tolerance
            )
            for s in scores
            if s.evidence >= min_evidence or s.hypothesis in always
        }


def starting_robots(robot: Robot, hypothesis: Hypothesis, predictions: Sequence[PredictedGain]) -> tuple[Robot, ...]:
    """The robot with a hypothesis at each of its predicted values, and at its default ones."""
    default_setting = hypothesis.setting(robot)
    predicted_settings = [
        EffectSetting(default_setting.name, {**default_setting.values, **p.values}, default_setting.cables)
        for p in predictions
    ]
    return tuple(robot.with_effect(setting) for setting in (*predicted_settings, default_setting))


def shortlist(
    predictions: Mapping[Hypothesis, PredictedGain],
    rough_predictions: Mapping[Hypothesis, PredictedGain] | None = None,
    policy: ScoreTestPolicy = DEFAULT_POLICY.score_test,
    has_disturbance: bool = False,
) -> list[Hypothesis]:
    """Shortlist of the best predictions, few of each effect; the best of ``rough_predictions`` replace the last.

    Those are of another score test of the same hypotheses, with process noise.
    """
    ranked, others = (_ranked(each, policy, has_disturbance) for each in (predictions, rough_predictions or {}))
    leading = ranked[: policy.max_fits - policy.max_rough_fits]
    added = [hypothesis for hypothesis in others[: policy.max_rough_fits] if hypothesis not in leading]
    remaining = [hypothesis for hypothesis in ranked if hypothesis not in added]
    return [*remaining[: policy.max_fits - len(added)], *added]


def _ranked(
    predictions: Mapping[Hypothesis, PredictedGain], policy: ScoreTestPolicy, has_disturbance: bool
) -> list[Hypothesis]:
    ranked: list[Hypothesis] = []
    for hypothesis in sorted(predictions, key=lambda hypothesis: -predictions[hypothesis].gain):
        alike = [other for other in ranked if other.effect is hypothesis.effect]
        is_limited = has_disturbance and any(len(other.cables) > 1 for other in alike)
        if len(alike) < (policy.max_fits_beside_disturbance if is_limited else policy.max_fits_per_effect):
            ranked.append(hypothesis)
    min_gain = policy.min_predicted_gain
    if ranked:
        min_gain = max(min_gain, policy.min_gain_ratio * predictions[ranked[0]].gain)
    return [hypothesis for hypothesis in ranked[: policy.max_fits] if predictions[hypothesis].gain >= min_gain]
