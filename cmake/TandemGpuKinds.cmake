# The kinds of GPU that Tandem is compiled for, by compute capability, as in CMAKE_CUDA_ARCHITECTURES.

# The least kind: warps add up by __reduce_add_sync().
set(TANDEM_LEAST_GPU_KIND 80)

# These run on each kind from the least one on where nobody says more: machine code for 9.0, and code that the driver
# compiles when a program first uses it, for later kinds and for earlier ones.
set(TANDEM_USUAL_GPU_KINDS 80-virtual 90)

# The kinds of the GPUs that nvidia-smi lists, a line "8.6" for each, or the usual ones where it lists none that
# Tandem can use.
function(tandem_gpu_kinds_here listed out)
  string(REGEX REPLACE "[\r\n]+" ";" lines "${listed}")
  set(kinds "")
  foreach(line ${lines})
    if(NOT line MATCHES "^[0-9]+\\.[0-9]$")
      continue()
    endif()
    string(REPLACE "." "" kind ${line})
    if(kind GREATER_EQUAL TANDEM_LEAST_GPU_KIND)
      list(APPEND kinds ${kind})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES kinds)
  if(NOT kinds)
    set(kinds ${TANDEM_USUAL_GPU_KINDS})
  endif()
  set(${out} "${kinds}" PARENT_SCOPE)
endfunction()

# Ends with a message where there is an older kind among them.
function(tandem_require_gpu_kinds)
  foreach(kind ${ARGN})
    string(REGEX MATCH "^[0-9]+" number "${kind}")
    if(kind MATCHES "^all" OR (number AND number LESS TANDEM_LEAST_GPU_KIND))
      message(FATAL_ERROR "Tandem: CMAKE_CUDA_ARCHITECTURES has ${kind}, but the least kind of GPU is compute capability 8.0 "
        "(RTX 30, A100): leave out what is below 80; the preset all-gpus names all kinds from there on")
    endif()
  endforeach()
endfunction()
