"""Effects outside the list: formulas and resonances that the residual at the ports shows."""
