// The only code that knows MPI: a library of its own, which Ranks::join loads where a launcher started the process.
// Each function returns 0, or what MPI says.
#include <limits.h>
#include <mpi.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

// one_host: whether all ranks run on this host.
int selvedge_mpi_begin(int* rank, int* size, int* one_host) {
  int error = MPI_Init(NULL, NULL);
  if (error != MPI_SUCCESS) return error;
  MPI_Comm_rank(MPI_COMM_WORLD, rank);
  MPI_Comm_size(MPI_COMM_WORLD, size);
  char name[256] = {0};
  gethostname(name, sizeof name - 1);
  uint64_t hash = 1469598103934665603u;  // FNV-1a
  for (const char* c = name; *c; ++c) hash = (hash ^ (unsigned char)*c) * 1099511628211u;
  uint64_t least = 0, most = 0;
  error = MPI_Allreduce(&hash, &least, 1, MPI_UINT64_T, MPI_MIN, MPI_COMM_WORLD);
  if (error == MPI_SUCCESS) error = MPI_Allreduce(&hash, &most, 1, MPI_UINT64_T, MPI_MAX, MPI_COMM_WORLD);
  *one_host = least == most;
  return error;
}

// The first rank's text becomes everybody's.
int selvedge_mpi_tell(char* text, int capacity) { return MPI_Bcast(text, capacity, MPI_CHAR, 0, MPI_COMM_WORLD); }

int selvedge_mpi_end(void) { return MPI_Finalize(); }
