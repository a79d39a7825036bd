/* Numbers on grids, with 8 or 16 bits each. */
inline integer grid_packed(integer name) { return sel_i((name & MEDIUM_BYTES) != 0, (integer)(2), (integer)(1)); }

/* The number at index `at` of a brick over the brick's highest; word: the word that holds it. */
inline real grid_number_at(integer packed, integer word, integer at)
{
    mask small = packed == 2;
    integer place = sel_i(small, (at & 3) << 3, (at & 1) << 4), most = sel_i(small, (integer)(0xff), (integer)(0xffff));
    return to_real((word >> place) & most) / to_real(most);
}

/* Twin, where all numbers have 16 bits. */
inline integer grid_packed(integer name) { return (integer)(1); }
inline real grid_number_at(integer packed, integer word, integer at)
{
    return to_real((word >> ((at & 1) << 4)) & 0xffff) * (1.0f / 65535.0f);
}
