/* Stands for transport/aimed_rival.cl where no light path is aimed. */
#define aimed_rival(rival, r) (rival)
