"""Every figure and number of Baklouti et al. (2017) as the FMUs give them, beside what the paper prints."""

from .paper_reproduction import write_paper

__all__ = ["write_paper"]
