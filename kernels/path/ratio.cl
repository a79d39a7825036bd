/* The density of a path at each of its wavelengths over their mean, where it differs: see path/hero.cl. */
#if USES_RATIO
#define hero_ratio(path, at) load_path_ratio(path, at)
#define hero_keep(path, at, m, ratio) store_path_ratio(path, at, m, ratio)
#else
#define hero_ratio(path, at) spectrum_of(1.0f)
#define hero_keep(path, at, m, ratio)
#endif
