"""Light in media: scenes of Mitsuba's format, made from formulas, and references of long renders.

`python -m bench.media [SCENE ...]` measures clpt and Mitsuba beside each other.
"""
