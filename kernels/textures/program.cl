/* A texture that combines others, written as a program in postfix order: OpenCL has no recursion, and a
 * copy of every look-up for each level of a tree would take minutes to build. An instruction is two words:
 * what to do, and an argument. It takes an operand (what is looked up, or if none the top of the stack),
 * and pushes it, multiplies the top by it, or mixes the two topmost values by it. All lanes go through the
 * loop together, each along its own program. clpt/render/textures/programs.py writes programs;
 * generated are the names of their codes, TEXTURE_DEPTH, how deep they go, and `texture_operand`. */
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
