"""Light that path tracing finds late or never: caustics, seen directly and through glass and water.

`python -m bench.hard_light [SCENE ...]` measures renderers beside references. `scenes` makes the
scenes from formulas, `reference` their references, `peers` runs the renderers.
"""
