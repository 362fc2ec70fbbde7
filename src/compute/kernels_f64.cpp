#define HEXOPT_HOST_KERNELS f64
#define HEXOPT_HOST_FUNCTION host_function_f64
#define HEXOPT_REAL double
#define HEXOPT_POINT_REAL double
#include "compute/host_kernels.inl"
