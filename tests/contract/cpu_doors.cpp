#include "contract/doors.h"

namespace tandem::test {

std::vector<NamedDoor> doors() {
  return {{"cpp", "cpp", [] { return cpp_door(std::make_shared<Scene>()); }},
          {"c", "c", [] { return c_door(tandem_scene_create); }}};
}

bool doors_are_usable() {
  return true;
}

}  // namespace tandem::test
