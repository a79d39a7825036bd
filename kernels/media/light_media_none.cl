/* Stands for media/light_media.cl where no path starts at lights. */
#define MEDIA_OF_SHAPES (4 * MEDIUM_AIMS)
