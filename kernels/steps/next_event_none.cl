/* Stands for steps/next_event.cl without lights, and at materials that send light one way only. */
typedef integer NextEvent;

inline NextEvent next_event(Scene scene, mask next, Vertex v, Scattering *scatter, Rival rival, Guided guided,
                            Spectrum ratio SHADE_ARGS)
{
    bsdf_ask(scene, scatter, scatter->wo, 0);
    return 0;
}
#define next_event_keep(scene, path, shadow, at, active, v, e) ((integer)(0))
