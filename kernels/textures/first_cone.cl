/* The first Path.cone of a camera path, from its ray and a ray a pixel farther. */
#include "textures/cone.cl"

/* Step. */

inline integer first_cone(Scene scene, CameraRay ray, vec2 position, vec2 lens, Wavelengths lambdas)
{
    vec2 beside = {position.x + 1.0f / to_real((integer)(scene.settings->film_width)),
                   position.y + 1.0f / to_real((integer)(scene.settings->film_height))};
    Spectrum unused;
    CameraRay other = first_ray(scene, beside, lens, lambdas, &unused);
    return cone_word(cone_of_pixel(ray.o, ray.d, other.o, other.d));
}

/* Twin, where the rays of neighbouring pixels have nothing to do with each other: images show their finest level. */
inline integer first_cone(Scene scene, CameraRay ray, vec2 position, vec2 lens, Wavelengths lambdas)
{
    return (integer)(0);
}
