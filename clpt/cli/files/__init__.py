"""The files of pictures that commands write, go on from and show."""
