/* Multiple scattering of camera paths: a block of lanes goes from collision to collision while most lanes collide. */

/* The most collisions of a block in a row. */
#define WALK 16

/* Whether a block of paths takes the n-th step through the medium: more than half of its lanes must wait for this
 * kind of phase function. The other lanes pause, and *ended keeps their states. */
called int queue_walks(Slab path, Slab hit, int kind, int n, integer *ended, uint block)
{
    union { integer all; int each[LANES]; } kinds;
    kinds.all = waiting_kind(path, hit, block);
    mask walks = kinds.all == kind;
    *ended = sel_i(walks, *ended, *ended | load_path_state(path, block));
    store_path_state(path, block, !walks, (integer)(0));
    int count = 0;
    for (uint i = 0; i < LANES; i++) count += kinds.each[i] == kind;
    return n < WALK && 2 * count > LANES;
}
/* Resumes the lanes that paused. */
called void queue_walked(Slab path, integer ended, uint block) { store_path_state(path, block, ended != 0, ended); }

/* Takes all paths that wait for a phase function through the medium, then sorts their slots again. starts: of each
 * kind's queue; block: the first of LANES slots for a block; leave: raised, it lets all paths stay where they are. */
inline void bounce_walk(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, uint which, global uint *queue, uint *starts, uint first,
                        uint end, global const volatile uint *leave)
{
    SLABS
    constant BlockWords *words = BLOCK_WORDS(which);
    uint block = BLOCK;
    for (int kind = 0; kind < BSDF_COUNT; kind++) {
        uint ends = kind_is_phase(kind) ? starts[kind + 1] : 0;
        for (uint entry = starts[kind]; entry < ends; entry += LANES) {
            integer ended = 0;
            queue_take(path, hit, shadow, words, queue, entry, ends, block);
            for (int n = 0; !(leave && *leave) && queue_walks(path, hit, kind, n, &ended, block); n++) {
                bounce_shade(kind, block, block + LANES);
                bounce_join(block, block + LANES);
                bounce_intersect(block, block + LANES);
                bounce_flight(block, block + LANES);
                bounce_mix(block, block + LANES);
            }
            queue_walked(path, ended, block);
            queue_return(path, hit, words, words->hit_words, words->hit, queue, entry, ends, block);
        }
    }
    queue_sort(path, hit, queue, starts, first, end);
}

/* Twin, where no camera path is in a medium. */
inline void bounce_walk(SLAB_ARGS, SCENE_ARGS, LOOP_ARGS, uint which, global uint *queue, uint *starts, uint first,
                        uint end, global const volatile uint *leave) {}
