"""``python -m tautwire.cli``: the command line without its installed script."""

from .application import main

if __name__ == "__main__":
    main()
