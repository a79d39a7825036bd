/* A value that nodes compute, see textures/graph.cl: linear Rec. 709, which becomes a spectrum as the texels of an
 * image do. `graph_value` calls the function of the graph's structure. */
inline vec4 graph_colour(Graph t, Scene scene, TexturePoint point)
{
    return graph_value(t, scene, t.kind == TEXTURE_GRAPH, point);
}

Spectrum graph_reflectance(Graph t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    vec4 c = graph_colour(t, scene, point);
    return spectrum_colour(scene, t.uplift, v3(c.x, c.y, c.z), t.bounded != 0, lambdas);
}

Spectrum graph_emission(Graph t, Scene scene, TexturePoint point, Wavelengths lambdas)
{
    return spectrum_mul(graph_reflectance(t, scene, point, lambdas),
                        spectrum_grey_light(scene, (real)(1.0f), lambdas));
}

real graph_real(Graph t, Scene scene, TexturePoint point)
{
    vec4 c = graph_colour(t, scene, point);
    real bright = 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z;
    real one = sel(t.channel == GRAPH_CHANNEL_R, c.x, sel(t.channel == GRAPH_CHANNEL_G, c.y, c.z));
    one = sel(t.channel == GRAPH_CHANNEL_A, c.w, one);
    return sel(t.channel == GRAPH_CHANNEL_LUMINANCE, bright, one);
}
