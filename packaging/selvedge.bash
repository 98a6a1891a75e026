# Completion of selvedge's command line for bash: the programs that are installed say what they know.
source <(selvedge completion bash)
