"""`python -m sonarsynth`: the command line."""

from sonarsynth.cli import main

if __name__ == "__main__":
    main()
