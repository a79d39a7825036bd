#!/bin/sh
set -e
python3 -m venv venv
venv/bin/python -m pip install clpt
cat > clpt <<'END'
#!/bin/sh
"$(dirname "$0")/venv/bin/clpt" "$@" > "$LOG_FILE" 2>&1
echo $? > ~/test-exit-status
END
chmod +x clpt
