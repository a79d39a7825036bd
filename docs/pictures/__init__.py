"""Pictures of every kind, as the reference of scenes and the gallery show them.

`python -m docs.pictures` renders all of them, `python -m docs.pictures material/hair light` some.
"""
