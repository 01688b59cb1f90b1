"""The rules by which a number of the paper is reproduced or not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tautwire.paper.paper_claims import Claim, LedgerEntry, text_claims

CLAIM = Claim(
    "it",
    "4.1",
    "a length",
    "mm",
    paper_value=2.4,
    upper_tolerance=0.1,
    lower_tolerance=0.05,
    corrections=("another area",),
)


@pytest.mark.parametrize(("ours", "agrees"), [(2.36, True), (2.49, True), (2.5, True), (2.51, False), (2.34, False)])
def test_number_agrees_that_rounds_or_is_cut_off_to_the_printed_digits(ours: float, agrees: bool) -> None:
    assert CLAIM.agrees(ours) is agrees
    assert replace(CLAIM, paper_value=-2.4).agrees(-ours) is agrees, "size counts, not sign"


def test_bounds_and_ranges_are_kept_or_broken() -> None:
    assert replace(CLAIM, rule="below").agrees(2.3) and not replace(CLAIM, rule="below").agrees(2.5)
    assert replace(CLAIM, rule="above").agrees(2.5) and not replace(CLAIM, rule="above").agrees(2.3)
    within = replace(CLAIM, paper_value=(1.0, 2.0), rule="within")
    assert within.agrees(1.5) and not within.agrees(2.1)
    assert not CLAIM.agrees(None)


FITTING = ((0.0, 10.0), (1.0, 7.0), (-0.1, 9.0))
BEYOND, TOO_SHORT = (-1.0, 9.0), (4.0, 8.0)


@pytest.mark.parametrize("ours", [*FITTING, BEYOND, TOO_SHORT])
def test_curve_agrees_that_lies_on_the_printed_axis_and_fills_it(ours: tuple[float, float]) -> None:
    assert replace(CLAIM, paper_value=(0.0, 10.0), rule="axis").agrees(ours) is (ours in FITTING)


def test_verdict_says_which_parameters_it_took() -> None:
    assert LedgerEntry(CLAIM, printed=2.4, corrected=3.0).verdict == "reproduced"
    after = LedgerEntry(CLAIM, printed=3.0, corrected=2.4)
    assert after.verdict == "reproduced after correction" and after.explanation == "another area"
    assert LedgerEntry(CLAIM, printed=3.0, corrected=3.1).verdict == "not reproducible"


def test_printed_parameters_count_only_where_their_motion_is_the_papers() -> None:
    assert LedgerEntry(CLAIM, printed=2.4, corrected=3.0, same_motion=False).verdict == "not reproducible"


def test_claims_have_unique_ids_and_need_existing_claims() -> None:
    claims = text_claims()
    ids = [claim.id for claim in claims]
    assert len(set(ids)) == len(ids) > 80
    assert {claim.required_claim for claim in claims} - {""} <= set(ids)


def test_claims_on_a_fitted_rope_share_one_allowance_where_digits_are_finer() -> None:
    by_id = {claim.id: claim for claim in text_claims()}
    fine, coarse = by_id["fast.tension_gap"], by_id["caroca.error_gap"]
    assert (fine.upper_tolerance, fine.lower_tolerance) == pytest.approx((0.03 * 71.35, 0.03 * 71.35))
    assert "3 % allowed" in fine.explanation
    assert (coarse.upper_tolerance, coarse.lower_tolerance) == pytest.approx((0.01, 0.005))
    assert "allowed" not in coarse.explanation


def test_digits_of_the_paper_make_the_tolerance() -> None:
    by_id = {claim.id: claim for claim in text_claims()}
    claim = by_id["caroca.elongation_gap"]
    assert (claim.paper_value, claim.upper_tolerance, claim.lower_tolerance) == pytest.approx((0.034, 0.001, 0.0005))
    about = by_id["ramp.three.stiffening"]
    assert about.upper_tolerance == 3.0 and about.explanation == '"about 30 %"; 3 % allowed', "a tolerance is named"
