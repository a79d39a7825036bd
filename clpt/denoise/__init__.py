"""Pictures without most of their noise: Open Image Denoise, and a statistical denoiser of our own.

`needs` adds to a scene what denoisers read, `oidn` calls Open Image Denoise. Pictures are arrays
of the host, so that they may come from any renderer, or from a film in a file.
"""
