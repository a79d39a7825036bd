/* The layers of a coated material in RGB mode: where their colours lie in `spectra`, and which share of
 * their thickness is there. The generated `film_profile` stands before this. */
typedef struct {
    Scene scene;
    integer count, table, rows; /* layers; first number in `spectra`; how many profiles it has */
    real profile;
} Layers;
inline Layers layers_load(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)
{
    integer row = gather_i(scene.materials, at);
    Layers l = {scene, gather_i(scene.materials, at + 1), gather_i(scene.materials, row),
                gather_i(scene.materials, row + 1), film_profile(scene, row + 2, point, lambdas)};
    return l;
}
