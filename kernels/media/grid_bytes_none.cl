/* Stands for media/grid_bytes.cl where all numbers have 16 bits. */
#define grid_packed(name) ((integer)(1))
#define grid_number_at(packed, word, at) (to_real(((word) >> (((at) & 1) << 4)) & 0xffff) * (1.0f / 65535.0f))
