/* The exact field of view on a grid, in plain C: what marsupial.maps.sight is timed against.
 *
 * A cell is visible when some ray from the centre of the observer's cell touches it without crossing an opaque cell
 * before; two opaque cells that touch at a corner let nothing through. Each octant is swept row by row with the slopes
 * that are still open.
 */

#include <stdint.h>
#include <stdlib.h>

typedef struct {
    double low, high; /* slopes from the octant's axis, 0, to its diagonal, 1 */
} Interval;

typedef struct {
    const uint8_t *cells;  /* (height, width) */
    const uint8_t *opaque; /* (256,): which codes of cells block sight */
    int64_t height, width;
    int64_t *stamps; /* (height, width): the number of the last view in which each cell was seen */
    int64_t stamp;   /* that of this view */
    int64_t *seen;   /* receives the cells, row-major */
} View;

static const double LEAST = 1e-9; /* intervals that are narrower are closed */

static const int OCTANTS[8][4] = {/* forward x and y, sideways x and y */
                                  {1, 0, 0, 1},  {0, 1, 1, 0},   {0, 1, -1, 0}, {-1, 0, 0, 1},
                                  {-1, 0, 0, -1}, {0, -1, -1, 0}, {0, -1, 1, 0}, {1, 0, 0, -1}};

/* Look along row k of an octant through one interval; enter what stays open of it behind that row, return how much. */
static int64_t look(const View *view, int64_t x, int64_t y, const int *octant, int64_t k, double limit, Interval open,
                    Interval *behind, int64_t *count)
{
    const double near = k - 0.5, far = k + 0.5;
    double start = open.low;
    int64_t left = 0;
    for (int64_t j = (int64_t)(start * near + 0.5); start < open.high - LEAST; j++) {
        const double low = j > 0 ? (j - 0.5) / far : 0.0, high = (j + 0.5) / near;
        if (low >= open.high - LEAST)
            break;
        const int64_t px = x + octant[0] * k + octant[2] * j, py = y + octant[1] * k + octant[3] * j;
        const int inside = px >= 0 && px < view->width && py >= 0 && py < view->height;
        const int64_t cell = py * view->width + px;
        if (inside && high <= start + LEAST)
            continue;
        if (inside && view->stamps[cell] != view->stamp && (double)(k * k + j * j) <= limit) {
            view->stamps[cell] = view->stamp;
            view->seen[(*count)++] = cell;
        }
        if (inside && !view->opaque[view->cells[cell]])
            continue;
        if (low > start + LEAST)
            behind[left++] = (Interval){start, low};
        if (high > start)
            start = high;
    }
    if (start < open.high - LEAST)
        behind[left++] = (Interval){start, open.high};
    return left;
}

/* Enter the cells that are visible from (x, y) within `reach` cells; return how many there are, -1 without memory. */
int64_t sight(const uint8_t *cells, const uint8_t *opaque, int64_t height, int64_t width, int64_t *stamps,
              int64_t stamp, int64_t *seen, int64_t x, int64_t y, double reach)
{
    const View view = {cells, opaque, height, width, stamps, stamp, seen};
    const int64_t room = 2 * (height > width ? height : width) + 8;
    const double limit = reach * reach + 1e-6;
    Interval *both = malloc(2 * room * sizeof(Interval));
    int64_t count = 1;
    if (!both)
        return -1;
    stamps[y * width + x] = stamp;
    seen[0] = y * width + x;
    for (int i = 0; i < 8; i++) {
        Interval *here = both, *next = both + room;
        int64_t open = 1;
        here[0] = (Interval){0.0, 1.0};
        for (int64_t k = 1; k <= (int64_t)reach && open > 0; k++) {
            int64_t behind = 0;
            for (int64_t each = 0; each < open; each++)
                behind += look(&view, x, y, OCTANTS[i], k, limit, here[each], next + behind, &count);
            Interval *swap = here;
            here = next;
            next = swap;
            open = behind;
        }
    }
    free(both);
    return count;
}
