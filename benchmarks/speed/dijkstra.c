/* Shortest distances on a grid, in plain C: what the searches of marsupial.paths are timed against.
 *
 * Eight-connected: a step costs 1, a diagonal one sqrt 2 and needs both cells beside it open. Grids are flat and framed
 * by closed cells, so that nothing tests for the edge of the map. There are two queues: a binary heap, as in every
 * textbook, and buckets of width 1, which are exact since no step is shorter than that. Of both, entries that were
 * overtaken by a shorter way are left where they are and skipped when their turn comes.
 */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

typedef struct {
    double cost;
    int64_t cell;
} Entry;

typedef struct {
    Entry *entries;
    int64_t count, room;
} List;

typedef struct {
    const uint8_t *open; /* (size,): which cells are open, those of the frame are not */
    int64_t row, size;   /* cells of a row, and of all rows, those of the frame included */
    double *cost;        /* (size,): receives distances, infinite where nothing was reached */
} Grid;

/* A heap uses the first list, buckets use all three in turn; `level` is the lowest cost in the first of them.
 *
 * Functions are told which it is by an argument that is a constant where they are inlined.
 */
typedef struct {
    List lists[3];
    int first;
    double level;
} Queue;

#define INLINED static inline __attribute__((always_inline))

static int append(List *list, double cost, int64_t cell)
{
    if (list->count == list->room) {
        int64_t room = list->room ? 2 * list->room : 1024;
        Entry *entries = realloc(list->entries, room * sizeof(Entry));
        if (!entries)
            return 0;
        list->entries = entries;
        list->room = room;
    }
    list->entries[list->count++] = (Entry){cost, cell};
    return 1;
}

static int push_to_heap(List *heap, double cost, int64_t cell)
{
    if (!append(heap, cost, cell))
        return 0;
    Entry *entries = heap->entries;
    int64_t at = heap->count - 1;
    while (at > 0 && entries[(at - 1) / 2].cost > cost) {
        entries[at] = entries[(at - 1) / 2];
        at = (at - 1) / 2;
    }
    entries[at] = (Entry){cost, cell};
    return 1;
}

static Entry pop_from_heap(List *heap)
{
    Entry *entries = heap->entries, top = entries[0], last = entries[--heap->count];
    int64_t at = 0;
    for (;;) {
        int64_t child = 2 * at + 1;
        if (child >= heap->count)
            break;
        if (child + 1 < heap->count && entries[child + 1].cost < entries[child].cost)
            child++;
        if (entries[child].cost >= last.cost)
            break;
        entries[at] = entries[child];
        at = child;
    }
    if (heap->count > 0)
        entries[at] = last;
    return top;
}

INLINED int push(Queue *queue, int buckets, double cost, int64_t cell)
{
    if (!buckets)
        return push_to_heap(&queue->lists[0], cost, cell);
    int ahead = cost < queue->level + 1 ? 0 : cost < queue->level + 2 ? 1 : 2;
    return append(&queue->lists[(queue->first + ahead) % 3], cost, cell);
}

/* Take an entry that no other one is shorter than by 1 or more; say whether there was one. */
INLINED int pop(Queue *queue, int buckets, Entry *entry)
{
    if (!buckets) {
        if (queue->lists[0].count == 0)
            return 0;
        *entry = pop_from_heap(&queue->lists[0]);
        return 1;
    }
    for (int tried = 0; tried < 3; tried++) {
        List *list = &queue->lists[queue->first];
        if (list->count > 0) {
            *entry = list->entries[--list->count];
            return 1;
        }
        queue->first = (queue->first + 1) % 3;
        queue->level += 1;
    }
    return 0;
}

/* Search outward from a source until all wanted cells are final, or everything is where there is none; 0: no memory. */
INLINED int spread(Grid grid, Queue *queue, int buckets, int64_t source, const int64_t *wanted, int64_t left)
{
    const int64_t row = grid.row;
    const int64_t around[8] = {1, row + 1, row, row - 1, -1, -row - 1, -row, -row + 1};
    const int everything = left == 0;
    Entry entry;

    for (int64_t cell = 0; cell < grid.size; cell++)
        grid.cost[cell] = INFINITY;
    for (int i = 0; i < 3; i++)
        queue->lists[i].count = 0;
    queue->first = 0;
    queue->level = 0;
    grid.cost[source] = 0;
    if (!push(queue, buckets, 0, source))
        return 0;
    while (pop(queue, buckets, &entry)) {
        if (entry.cost > grid.cost[entry.cell])
            continue;
        const double final = buckets ? queue->level + 1 : entry.cost;
        while (left > 0 && grid.cost[wanted[left - 1]] <= final)
            left--;
        if (left == 0 && !everything)
            return 1;
        for (int turn = 0; turn < 8; turn++) {
            const uint8_t *open = grid.open + entry.cell;
            if (!open[around[turn]])
                continue;
            if (turn & 1 && !(open[around[turn - 1]] && open[around[(turn + 1) & 7]]))
                continue;
            const int64_t next = entry.cell + around[turn];
            const double cost = entry.cost + (turn & 1 ? 1.4142135623730951 : 1.0);
            if (cost < grid.cost[next]) {
                grid.cost[next] = cost;
                if (!push(queue, buckets, cost, next))
                    return 0;
            }
        }
    }
    return 1;
}

static int search(Grid grid, Queue *queue, int buckets, int64_t source, const int64_t *wanted, int64_t count)
{
    return buckets ? spread(grid, queue, 1, source, wanted, count) : spread(grid, queue, 0, source, wanted, count);
}

static void discard(Queue *queue)
{
    for (int i = 0; i < 3; i++)
        free(queue->lists[i].entries);
}

/* Find the distances from a source, an open cell, to `count` wanted ones; to all cells where that is 0. */
int field(const uint8_t *open, int64_t row, int64_t size, int buckets, int64_t source, const int64_t *wanted,
          int64_t count, double *cost)
{
    Queue queue = {0};
    const int done = search((Grid){open, row, size, cost}, &queue, buckets, source, wanted, count);
    discard(&queue);
    return done;
}

/* Find the distances (count, count) between open cells, each pair once; `cost` is to work in. */
int table(const uint8_t *open, int64_t row, int64_t size, int buckets, const int64_t *cells, int64_t count,
          double *cost, double *found)
{
    Queue queue = {0};
    int done = 1;
    for (int64_t i = 0; i < count && done; i++) {
        found[i * count + i] = 0;
        if (i + 1 < count)
            done = search((Grid){open, row, size, cost}, &queue, buckets, cells[i], cells + i + 1, count - i - 1);
        for (int64_t j = i + 1; j < count; j++)
            found[i * count + j] = found[j * count + i] = cost[cells[j]];
    }
    discard(&queue);
    return done;
}
