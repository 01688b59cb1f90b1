"""Localisation of model error: residuals of single FMUs at their measured ports."""
