"""Discovery of formulas and resonances outside the list of known effects."""
