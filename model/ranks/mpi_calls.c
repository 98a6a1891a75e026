#include "mpi_calls.h"

#include <mpi.h>
#include <stddef.h>

/* One thread alone makes these calls, though others compute. */
static int begin(int* rank, int* size) {
  int provided = 0;
  const int error = MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided);
  if (error != MPI_SUCCESS) return error;
  MPI_Comm_rank(MPI_COMM_WORLD, rank);
  return MPI_Comm_size(MPI_COMM_WORLD, size);
}

static int send(const char* bytes, int count, int to, int tag) {
  return MPI_Send(bytes, count, MPI_BYTE, to, tag, MPI_COMM_WORLD);
}

static int look(int* there, int* from, int* tag, int* count) {
  MPI_Status status;
  const int error = MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, there, &status);
  if (error != MPI_SUCCESS || !*there) return error;
  *from = status.MPI_SOURCE;
  *tag = status.MPI_TAG;
  return MPI_Get_count(&status, MPI_BYTE, count);
}

static int receive(char* bytes, int count, int from, int tag) {
  return MPI_Recv(bytes, count, MPI_BYTE, from, tag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

static int end(void) { return MPI_Finalize(); }

const struct SelvedgeMpiCalls selvedge_mpi_calls = {begin, send, look, receive, end};
