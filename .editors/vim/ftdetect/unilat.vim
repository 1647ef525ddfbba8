autocmd BufRead,BufNewFile *.inp setfiletype unilat
