/* The equal parts of the sphere of a guide's row: in height, and around z. */
#define GUIDE_ROWS 16
#define GUIDE_COLUMNS 16
#define GUIDE_BINS (GUIDE_ROWS * GUIDE_COLUMNS)
