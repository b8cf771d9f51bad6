// A driver of an NVIDIA GPU that is too old, as far as CUDA asks: it says that it is of CUDA 8.0. Built as
// libcuda.so.1, so that a program finds it before the real one.
extern "C" {

int cuInit(unsigned /*flags*/) {
  return 0;
}

int cuDriverGetVersion(int* version) {
  *version = 8000;
  return 0;
}

int cuGetProcAddress(const char* /*symbol*/, void** function, int /*version*/, unsigned long /*flags*/) {
  constexpr int kNotFound = 500;
  *function = nullptr;
  return kNotFound;
}
}
