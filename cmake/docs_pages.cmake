# Makes the pages of the documentation that the program writes itself:
#   cmake -DPROGRAM=<dynfilter> -DFOLDER=<folder> -P docs_pages.cmake
# The folder is made anew; the pages are in its folder pages/.

function(run_program output)
  execute_process(COMMAND ${PROGRAM} ${ARGN} WORKING_DIRECTORY ${FOLDER}/run RESULT_VARIABLE failed
                  OUTPUT_VARIABLE printed ERROR_VARIABLE complaint)
  if(failed)
    string(JOIN " " arguments ${ARGN})
    message(FATAL_ERROR "dynfilter ${arguments} failed: ${complaint}")
  endif()
  set(${output} "${printed}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER}/run ${FOLDER}/pages)

run_program(page manual --markdown)
file(WRITE ${FOLDER}/pages/command_line.md "${page}")

run_program(ignored synth scene --level medium --frames 24 --seed 3)
run_program(ignored run scene --out out --overlays 4)
file(COPY ${FOLDER}/run/out/contact_sheet.png DESTINATION ${FOLDER}/pages)
run_program(table ablate scene --rules none,mask,paper,depth)
file(WRITE ${FOLDER}/pages/pictures.md
     "# Pictures of a run\n\n"
     "`dynfilter synth scene --level medium --frames 24 --seed 3` renders a scene with known truth, and "
     "`dynfilter run scene --out out --overlays 4` filters it. Red crosses were removed by masks, yellow "
     "diamonds by depth:\n\n![Every verdict of four frames](contact_sheet.png)\n\n"
     "`dynfilter ablate scene --rules none,mask,paper,depth` compares rules on it:\n\n"
     "```\n${table}```\n")
