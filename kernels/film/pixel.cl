/* Pixels: their indices in memory, and their positions on the film. They are stored in 4x4 tiles, row by
 * row in a tile and tile by tile in a row of them, with `margin` pixels on each side of the picture: samples there
 * serve pixels of the picture whose filters reach them. */

/* The index of the pixel (x, y) of the picture. */
inline integer film_pixel_index(global const Settings *settings, integer x, integer y)
{
    x += settings->margin;
    y += settings->margin;
    return ((y >> 2) * settings->tiles_x + (x >> 2)) * 16 + (y & 3) * 4 + (x & 3);
}

/* Column and row of the pixel at an index. */
inline void pixel_place(global const Settings *settings, integer pixel_index, integer *x, integer *y)
{
    integer tile = pixel_index >> 4, row = divide(tile, settings->tiles_x), column = tile - row * settings->tiles_x;
    *x = column * 4 + (pixel_index & 3) - settings->margin;
    *y = row * 4 + ((pixel_index >> 2) & 3) - settings->margin;
}

/* The pixel of the picture nearest to a pixel that may lie in the margin. */
inline integer film_nearest_index(global const Settings *settings, integer pixel_index)
{
    integer x, y;
    if (settings->margin == 0) return pixel_index;
    pixel_place(settings, pixel_index, &x, &y);
    x = max_i(min_i(x, (integer)(settings->width - 1)), (integer)(0));
    y = max_i(min_i(y, (integer)(settings->height - 1)), (integer)(0));
    return film_pixel_index(settings, x, y);
}

inline vec2 pixel_of_index(global const Settings *settings, integer pixel_index)
{
    integer x, y;
    pixel_place(settings, pixel_index, &x, &y);
    return (vec2){to_real(x), to_real(y)};
}

/* A point of the whole film, 0 to 1: `offset` [pixels] from the centre of a pixel of the picture. */
inline vec2 film_position(global const Settings *settings, vec2 pixel, vec2 offset)
{
    return (vec2){(pixel.x + (settings->crop_x + 0.5f) + offset.x) / (float)settings->film_width,
                  (pixel.y + (settings->crop_y + 0.5f) + offset.y) / (float)settings->film_height};
}
