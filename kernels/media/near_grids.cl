/* Of flights in grids none ends near lamps. */
#define flight_near_share(name, share) sel(((name) & MEDIUM_GRID) != 0, (real)(0.0f), share)

/* Twin, where there are no grids. */
#define flight_near_share(name, share) (share)
