/* Event functions g(t, y), one of whose falls through zero ends a run. */
#ifndef LAGRANGE_EVENTS_H
#define LAGRANGE_EVENTS_H

#include "kernel.h"

/* Intervals of a step at whose ends signs are looked at. */
#define LAGRANGE_PARTS 4

/* The sign of a function that is zero where the run begins, and then positive: its sign counts
 * from where it exceeds its noise. */
#define LAGRANGE_RISES 2.0

/* The caller sets everything, takes what was located, and sets `located` back to 0. */
typedef struct lagrange_events {
    lagrange_function function; /* all count values of g at once */
    const double *u;
    const void *p;
    double *work;
    double *sign;   /* count: 1, or LAGRANGE_RISES at first */
    const double *noise; /* count: of each g where it rises from 0 */
    const double *reach; /* count: a least value above zero is told below this */
    double *before; /* count: the signs before the last step */
    double *values; /* (LAGRANGE_PARTS + 4) rows of count */
    double *state;  /* n */
    int64_t count;
    int64_t capacity;
    int64_t located;
    int64_t first; /* where those of the last step begin */
    double *times; /* of the located ones, ascending: least values, and at last a zero */
    int64_t *indices; /* of each g; count and more: it has a least value there */
    double *states;
} lagrange_events;

#endif
