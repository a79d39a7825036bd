"""The reason why shapes cannot move on the device, as an exception."""


class CannotMove(Exception):
    """A change that the kernels of clpt.render.edit.moving cannot make; its text says why.

    It never leaves clpt: the scene is lowered again then, and the reason is logged.
    """
