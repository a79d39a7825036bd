/* Stands for the cell of a photon where there is none. */
#define PHOTON_NONE 0xffffffffu
