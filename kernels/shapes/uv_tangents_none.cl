/* Stands for shapes/uv_tangents.cl where nothing asks for directions along a surface. */
#define uv_tangents(scene, space, c, mapped, ta, tb, tc, s)
