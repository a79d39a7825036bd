/* Stands for media/walk.cl where no path from the camera is in a medium. */
#define bounce_walk(slabs, scene, loop, which, queue, starts, first, end)
