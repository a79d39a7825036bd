/* Layers beside the picture, in memory: sums over the first LAYER_SAMPLES samples of each pixel, so that they cost
 * little; whole numbers, which add in any order. What is summed is in film/layers_record.cl.
 *
 * `layers` has Settings.layer_words words for each pixel, side by side, as its samples then touch one line of a cache:
 * how many samples; a word for each number that is near 1, in units of 2^-22; four for others, in units of 2^18, 2^-6,
 * 2^-30 and 2^-54, the lower ones below 2^24, all of the number's sign; one for an id, 1 more than it, of the sample of
 * number 0. No word leaves its 32 bits, so words add without a carry. Settings.layer_<name> is the first word of a
 * layer. */
#include "film/sums.cl"
#include "generated/layer_sizes.cl"
#define LAYER_SAMPLES 64
#define LAYER_UNITS 0x1p22f
#define LAYER_LARGEST 7.9f /* times samples and units it is less than 2^31 */

/* Whether a sample is one of those that layers have. */
inline mask layers_want(Slab path, uint at, mask m) { return m & (load_path_sample(path, at) < LAYER_SAMPLES); }

/* What the pixel filter gives a sample: some have lobes below 0. */
#if FILM_WEIGHTS
#define layer_weight(path, at) ((real)(1.0f))
#else
#define layer_weight(path, at) load_path_weight(path, at)
#endif

/* Adds `count` words, each of all lanes, to the first ones of their pixels. Lanes that add are told first, as a branch
 * for each lane would take longer. Where there is one plane a slot owns its pixel, and needs no atomic operation. */
inline void layers_add(Scene scene, global uint *layers, mask m, integer pixel_index, const integer *words, int count)
{
    const int *adds = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *added = (const uint *)words;
    int lanes[LANES], n = 0;
    for (int i = 0; i < LANES; i++) {
        lanes[n] = i;
        n += adds[i] != 0;
    }
    for (int j = 0; j < n; j++) {
        int i = lanes[j];
        global uint *at = layers + (size_t)pixels[i] * scene.settings->layer_words;
        if (scene.settings->planes == 1)
            for (int k = 0; k < count; k++) at[k] += added[k * LANES + i];
        else
            for (int k = 0; k < count; k++) sums_add_word(at + k, added[k * LANES + i]);
    }
}

/* Counts the `unseen` paths, which have met nothing; others are counted where they meet the first surface. */
inline void layers_count(Scene scene, Slab path, uint at, mask unseen LAYER_ARGS)
{
    const integer one = 1;
    mask m = layers_want(path, at, unseen);
    if (any(m)) layers_add(scene, layers, m, load_path_pixel_index(path, at), &one, 1);
}

/* Puts three numbers that are near 1, of the lanes of m, into words that are to be added. */
inline void layer_put(integer *words, mask m, vec3 v)
{
    real most = sel(m, (real)(LAYER_LARGEST), (real)(0.0f));
    words[0] = to_integer(clamp_r(v.x, -most, most) * LAYER_UNITS);
    words[1] = to_integer(clamp_r(v.y, -most, most) * LAYER_UNITS);
    words[2] = to_integer(clamp_r(v.z, -most, most) * LAYER_UNITS);
}

/* Puts a number below 2^43: its digits from 2^-54 on, so that small ones keep theirs, above 0 and below. */
inline void layer_put_long(integer *words, mask m, real v)
{
    v = sel(m & (fabs(v) < 0x1p43f), v, (real)(0.0f));
    real unit = 0x1p18f, digits = trunc(v * 0x1p-18f);
    words[0] = to_integer(digits);
    for (int i = 1; i < LAYER_LONG_WORDS; i++) {
        v -= digits * unit; /* exact */
        unit *= 0x1p-24f;
        digits = trunc(v / unit);
        words[i] = to_integer(digits);
    }
}

/* Puts an id. */
inline void layer_put_id(integer *words, mask m, integer id) { words[0] = sel_i(m, id + 1, (integer)(0)); }

/* Names that a pixel's samples have met, and how often: words of a list, ascending. A word has 1 more than the
 * name's number in its upper 25 bits and how often in its lower 7; 0 is none. Of more names the first ones of the scene
 * are kept: a slot keeps the least that comes to it, with all its counts, and hands the others to the next slot. So
 * what it ends with depends neither on the order of samples nor on who adds them, and lists of films add likewise. */
inline void matte_add(global uint *list, uint number)
{
    uint word = ((number + 1u) << 7) | 1u;
    for (int i = 0; i < LAYER_MATTE_SLOTS && word; i++) {
        volatile global uint *slot = list + i;
        uint held = *slot;
        for (;;) {
            uint kept = held, onward = word;
            if (!held || (held >> 7) == (word >> 7)) kept = held ? held + (word & 127u) : word, onward = 0u;
            else if (word < held) kept = word, onward = held;
            uint found = kept == held ? held : atomic_cmpxchg(slot, held, kept);
            if (found == held) {
                word = onward;
                break;
            }
            held = found;
        }
    }
}

/* Adds the names with these numbers to the list `which` of the pixels. */
inline void mattes_add(Scene scene, global uint *mattes, mask m, integer pixel_index, int which, integer number)
{
    const int *adds = (const int *)&m, *pixels = (const int *)&pixel_index;
    const uint *numbers = (const uint *)&number;
    for (int i = 0; i < LANES; i++)
        if (adds[i]) {
            size_t list = (size_t)pixels[i] * scene.settings->mattes + which;
            matte_add(mattes + list * LAYER_MATTE_SLOTS, numbers[i]);
        }
}

/* Twin, where there are none beside the picture. */
inline void layers_count(Scene scene, Slab path, uint at, mask unseen LAYER_ARGS) {}
