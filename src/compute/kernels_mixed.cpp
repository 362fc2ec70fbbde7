#define HEXOPT_HOST_KERNELS mixed
#define HEXOPT_HOST_FUNCTION host_function_mixed
#define HEXOPT_REAL float
#define HEXOPT_POINT_REAL double
#include "compute/host_kernels.inl"
