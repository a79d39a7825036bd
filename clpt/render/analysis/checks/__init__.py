"""Rules of scenes: what a combination cannot do is refused here, before anything is lowered.

What passes is refused later only for what files or the device alone can tell: contents, and sizes.
"""

from .scene import check, check_at_rest

__all__ = ["check", "check_at_rest"]
