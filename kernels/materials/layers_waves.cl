/* The layers of a coated material in spectral mode: LAYER_WORDS words of `materials` each, read in
 * turn at the path's wavelengths. The generated `Layer` and `layer_load` stand before this. */
typedef struct {
    Scene scene;
    integer first, count; /* rows in `materials` */
    TexturePoint point;
    Wavelengths lambdas;
} Layers;
inline Layers layers_load(Scene scene, integer at, TexturePoint point, Wavelengths lambdas)
{
    integer first = gather_i(scene.materials, at), count = gather_i(scene.materials, at + 1);
    Layers l = {scene, first, count, point, lambdas};
    return l;
}
inline Layer layer_at(Layers l, integer i)
{
    return layer_load(l.scene, l.first + i * LAYER_WORDS, l.point, l.lambdas);
}
