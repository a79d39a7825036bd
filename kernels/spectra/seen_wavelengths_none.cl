/* Stands for spectra/seen_wavelengths.cl where nothing fluoresces. */
#define seen_wavelengths(scene, path, at, lambdas) (lambdas)
