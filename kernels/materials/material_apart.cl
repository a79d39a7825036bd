/* A material whose functions are a part of their own in the loop of a CPU, as several kinds share a vertex. It is of
 * the kind `scene.kind` in all LANES paths. A vertex asks it once (`bsdf_ask`, materials/pair_apart.cl), so that its
 * parameters are loaded once, and what a pair of directions and a sample have in common is computed once. */
typedef struct {
    integer row;
    TexturePoint point;
    Wavelengths lambdas;
    BsdfAnswer answer;
} Bsdf;

inline Bsdf bsdf_load(Scene scene, integer row, TexturePoint point, Wavelengths lambdas)
{
    Bsdf m;
    m.row = row;
    m.point = point;
    m.lambdas = lambdas;
    return m;
}
#define bsdf_albedo_in(scene, m) apart_albedo(scene, (m).row, (m).point, (m).lambdas)
