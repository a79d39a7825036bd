/* Independent uniform numbers: a hash of (seed, pixel, sample, dimension). */

inline Sampler sampler_start(uint seed, natural pixel, natural sample)
{
    Sampler s;
    s.seed = hash_natural(pixel ^ (seed * 0x9e3779b9u));
    s.index = hash_natural(sample + 0x7f4a7c15u);
    return s;
}

inline vec2 sampler_pair(Sampler s, natural dimension)
{
    natural a = hash_natural(s.seed + hash_natural(s.index + dimension * 0x9e3779b9u));
    return (vec2){unit_interval(a), unit_interval(hash_natural(a ^ 0x68bc21ebu))};
}
