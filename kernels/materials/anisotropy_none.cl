/* Stands for materials/anisotropy.cl where a material is equally rough in all directions, or knows no turn. */
#define anisotropy_turned(scene, row, m, s, shaded) (m)
