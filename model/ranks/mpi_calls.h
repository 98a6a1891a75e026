/* The MPI calls that ranks make, as one table of functions in a library of its own (mpi_calls.c), which is loaded where
   a launcher started the process: the program itself is linked without MPI. Each function returns 0, or MPI's error. */
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

struct SelvedgeMpiCalls {
  int (*begin)(int* rank, int* size);
  int (*send)(const char* bytes, int count, int to, int tag);
  /* Whether a message is there, from whom, with which tag, and how long; waits for nothing. */
  int (*look)(int* there, int* from, int* tag, int* count);
  int (*receive)(char* bytes, int count, int from, int tag);
  int (*end)(void);
};

#define SELVEDGE_MPI_CALLS "selvedge_mpi_calls"

#ifdef __cplusplus
}
#endif
