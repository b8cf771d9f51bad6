#pragma once

namespace tandem {

/// The tools return these codes to the shell. They never change.
enum ExitCode : int {
  kDone = 0,
  kUsage = 1,             ///< the command line is wrong, or asks for what cannot be had
  kUnreadableInput = 2,   ///< the input is missing, malformed or, under --strict, not flawless
  kNoTriangle = 3,        ///< the input holds no usable triangle
  kUnwritableOutput = 4,  ///< the output could not be written
  kInternal = 5,          ///< a defect of the program, or not enough memory
  kUnusableGpu = 6,       ///< no GPU can be used, or it has too little memory
};

}  // namespace tandem
