/* Of flights in grids none ends near lamps. */
inline real flight_near_share(integer name, real share) { return sel((name & MEDIUM_GRID) != 0, (real)(0.0f), share); }

/* Twin, where there are no grids. */
inline real flight_near_share(integer name, real share) { return share; }
