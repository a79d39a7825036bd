/* Stands for steps/join_camera.cl where light paths leave photons alone, or a material sends light one way only. */
inline integer join_camera(Scene scene, Slab shadow, uint at, mask active, Vertex v, Scattering *scatter, Rival rival,
                           real arrives)
{
    bsdf_ask(scene, scatter, scatter->wo, 1);
    return 0;
}
