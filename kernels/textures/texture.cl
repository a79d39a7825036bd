/* The contract of a texture kind: kernels/textures/kinds/<kind>.cl has
 *
 *   Spectrum <kind>_reflectance(<Kind> t, Scene scene, TexturePoint point, Wavelengths lambdas);
 *   Spectrum <kind>_emission   (<Kind> t, Scene scene, TexturePoint point, Wavelengths lambdas);
 *   real     <kind>_real       (<Kind> t, Scene scene, TexturePoint point);
 *
 * and an image, whose reflectance is a weighted mean of texels,
 *
 *   Spectrum <kind>_texel      (<Kind> t, Scene scene, TexturePoint point, vec2 u, Wavelengths lambdas);
 *
 * a random texel, with its weight as its probability, so that the mean is the reflectance (Fajardo et al. 2023,
 * "Stochastic Texture Filtering"). It serves where light is linear in the value.
 *
 * The struct <Kind> is a Record in clpt/render/records/textures.py whose rows lie in `textures`. A texture that
 * combines others is a program, see texture_program. */

/* A colour or spectrum that stands in `textures` in the five words that parameters have. */
inline Spectrum texture_constant(Scene scene, integer at, Wavelengths lambdas)
{
    vec4 words = row4(scene.textures, at);
    integer source = gather_i(scene.textures, at + 4);
    Spectrum value = spectrum_constant(words, lambdas);
    mask tabulated = source < 0;
    if (any(tabulated)) value = spectrum_sel(tabulated, spectrum_table(scene, words, source, lambdas), value);
    return value;
}

/* A point of the world in a texture's space; transform: the first of twelve words, three rows of a matrix. */
inline vec3 texture_transformed(Scene scene, integer transform, vec3 p)
{
    real r[3];
    for (int i = 0; i < 3; i++) {
        integer at = transform + 4 * i;
        vec4 row = row4(scene.textures, at);
        r[i] = dot3(v3(row.x, row.y, row.z), p) + row.w;
    }
    return v3(r[0], r[1], r[2]);
}

#if USES_ATTRIBUTES
/* A number that a mesh has per vertex, linear over a triangle; number: its index in the meshes' directories. */
inline real texture_vertex_number(Scene scene, TexturePoint point, integer number)
{
    integer entry = point.attributes + 2 * number;
    integer first = gather_i(scene.attributes, entry), words = gather_i(scene.attributes, entry + 1);
    real sum = 0.0f;
    for (int corner = 0; corner < 3; corner++) {
        integer vertex = texture_corner(scene, point, corner);
        real weight = corner == 0 ? 1.0f - point.b.x - point.b.y : corner == 1 ? point.b.x : point.b.y;
        sum += weight * gather_w(scene.attributes, first + words * vertex);
    }
    return sum;
}
#endif

/* u, v and 1: of the surface, of a point in a texture's space by a mapping of pbrt's, or of a mesh's second set.
 * USES_MAPPINGS: some texture has such a mapping. */
inline vec3 texture_uv(Scene scene, integer mapping, integer transform, TexturePoint point)
{
    vec3 uv = v3(point.uv.x, point.uv.y, (real)(1.0f));
#if USES_MAPPINGS
    mask mapped = mapping != MAPPING_UV;
    if (any(mapped)) {
        vec3 p = texture_transformed(scene, transform, point.p);
        real turn = atan2_r(p.y, p.x) * INV_2PI, theta = atan2_r(sqrt(p.x * p.x + p.y * p.y), p.z) * INV_PI;
        mask round = mapping == MAPPING_SPHERICAL, tube = mapping == MAPPING_CYLINDRICAL;
        real u = sel(round, theta, sel(tube, turn + 0.5f, p.x));
        real v = sel(round, sel(turn < 0.0f, turn + 1.0f, turn), sel(tube, p.z, p.y));
        uv = v3(sel(mapped, u, uv.x), sel(mapped, v, uv.y), uv.z);
#if USES_ATTRIBUTES
        mask second = mapping == MAPPING_UV1;
        if (any(second)) {
            integer at = sel_i(second, transform, (integer)(0));
            integer first = sel_i(second, gather_i(scene.textures, at), (integer)(0));
            integer next = sel_i(second, gather_i(scene.textures, at + 1), (integer)(0));
            uv.x = sel(second, texture_vertex_number(scene, point, first), uv.x);
            uv.y = sel(second, texture_vertex_number(scene, point, next), uv.y);
        }
#endif
    }
#endif
    return uv;
}

/* Step program: a texture that combines others, written as a program in postfix order: OpenCL has no recursion, and a
 * copy of every look-up for each level of a tree would take minutes to build. An instruction is two words: what to do,
 * and an argument. It takes an operand (what is looked up, or if none the top of the stack), and pushes it, multiplies
 * the top by it, or mixes the two topmost values by it. All lanes go through the loop together, each along its own
 * program. clpt/render/textures/encode.py writes programs; generated are the names of their codes, TEXTURE_DEPTH,
 * how deep they go, and `texture_operand`. */
#define OPERAND_OF(code) ((code) & 7)
#define OPERATION_OF(code) ((code) & 24)

inline Spectrum texture_program(Scene scene, int role, integer row, mask running, TexturePoint point,
                                Wavelengths lambdas)
{
    Spectrum stack[TEXTURE_DEPTH + 1];
    for (int i = 0; i <= TEXTURE_DEPTH; i++) stack[i] = spectrum_of(0.0f);
    integer at = sel_i(running, row + 1, (integer)(0));
    while (any(running)) {
        integer code = gather_i(scene.textures, at), argument = gather_i(scene.textures, at + 1);
        integer operand = OPERAND_OF(code), operation = OPERATION_OF(code);
        Spectrum v = texture_operand(scene, role, operand, argument, running, point, lambdas);
        mask popped = running & (operand == OPERAND_TOP);
        v = spectrum_sel(popped, stack[0], v);
        mask pushed = running & (operation == OPERATION_PUSH), mixed = running & (operation == OPERATION_MIX);
        Spectrum lower[TEXTURE_DEPTH + 1]; /* the stack without what was taken as the operand */
        for (int i = 0; i < TEXTURE_DEPTH; i++) lower[i] = spectrum_sel(popped, stack[i + 1], stack[i]);
        lower[TEXTURE_DEPTH] = stack[TEXTURE_DEPTH];
        for (int i = TEXTURE_DEPTH; i > 0; i--) {
            Spectrum below = i < TEXTURE_DEPTH ? lower[i + 1] : lower[i];
            stack[i] = spectrum_sel(pushed, lower[i - 1], spectrum_sel(mixed, below, lower[i]));
        }
        Spectrum mix = spectrum_madd(spectrum_sub(lower[0], lower[1]), v.x, lower[1]);
        Spectrum product = spectrum_mul(lower[0], v);
        stack[0] = spectrum_sel(running, spectrum_sel(pushed, v, spectrum_sel(mixed, mix, product)), stack[0]);
        running = running & ((code & PROGRAM_END) == 0);
        at = sel_i(running, at + 2, at);
    }
    return stack[0];
}
