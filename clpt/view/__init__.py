"""The live page of `clpt view`: a picture that is rendered while it is watched and steered.

`server` speaks with browsers and trusts none of them; `commands` is the table of all that a page
may ask for; `session` owns the renderers in a thread of its own. The page is in `static`.
"""
